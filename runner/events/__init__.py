"""Events: what a run watches for (`kinds`) and how crossings are found on dense output (`search`)."""
