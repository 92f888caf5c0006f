"""The operator's console: commands, label state, HTTP API, pages. It never touches a robot."""
