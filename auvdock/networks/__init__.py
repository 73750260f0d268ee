"""The papers' detection networks in PyTorch: blocks, models by configuration, their size and their export.

All but `config` and `catalog` need PyTorch, the optional extra `auvdock[train]`. Nothing that docks imports this room.
"""
