"""Running trials: objects, sampling, plan, cameras, robots, session, command line."""
