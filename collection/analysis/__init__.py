"""What is computed from whole sessions: new scores, evaluations, the report."""
