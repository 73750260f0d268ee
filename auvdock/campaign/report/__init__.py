"""A campaign's report: cells, figures, tables for the paper, one HTML file."""
