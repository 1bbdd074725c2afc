"""Tables, figures, reports and films."""
