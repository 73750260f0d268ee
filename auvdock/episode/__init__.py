"""One world and one pilot: the episode, its metrics and its result."""
