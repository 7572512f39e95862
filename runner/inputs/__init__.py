"""What drives a model: signals as tables with breakpoints, and how they become a kernel's input vector."""
