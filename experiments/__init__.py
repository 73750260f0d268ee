"""One file for each published table, comparison or picture."""
