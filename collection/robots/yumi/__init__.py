"""The driver of a real ABB YuMi with an IRC5 controller."""
