"""Monte Carlo campaigns: many episodes planned, run by several workers, stored and summed up."""
