"""Scenes: how a model looks at some moments, as a still picture and as an animation. Nothing here is compiled."""
