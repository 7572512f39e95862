"""What every run has, whatever its method: spans, stops, times to save, a growing log, events, slices."""
