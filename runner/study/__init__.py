"""What to run, described in TOML: reading it (`read`, `schema`, `units`) and running it (`run`)."""
