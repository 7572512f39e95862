"""Figures of anything over time: what stands in them, chosen and scaled; and drawing it. Nothing here is compiled."""
