"""The console's server: who may talk to it, its requests and its stream."""
