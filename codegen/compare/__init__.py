"""Hand-written equations of motion beside the derived ones: `sheet` reads, `difference` compares, `report` tells."""
