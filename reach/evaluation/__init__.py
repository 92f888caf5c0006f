"""How well a model's scores predict what the robot did: metrics, intervals, references.

cases -> scoring -> scored -> table
"""
