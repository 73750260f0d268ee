"""Metrics: the one place where the truth and what perception made of it meet. docs/metrics.md says what each means."""
