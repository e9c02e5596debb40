"""Few returns by their likelihood, beside the other estimators and the least possible errors."""
