"""The rotating beacon of paper B: its own formulae and method, and a better one beside them."""
