"""The commands of the runner, one a file: each reads, computes, draws, prints, and gives the exit status."""
