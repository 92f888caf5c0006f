"""What a console is given to show: the session's state, lists and pictures, as plain values."""
