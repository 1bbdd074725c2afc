"""The paper's six cases, its figures and its statements."""
