"""The printable objects of our own."""
