"""Hand-eye calibration: views of a chessboard, the solution, and the file it lives in."""
