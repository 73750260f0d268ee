"""Compiled maths that kernels of several rooms share, the constants that they agree on, and what compiles them.

The ground floor: it imports nothing of the project. A kernel, that is a function under `compiled`, names globals of its
own file and of this room only, and code that is kept on disk is left when either changes (`numeric.kept_code`).
"""
