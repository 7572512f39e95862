"""What a text such as `65 kN/m` is worth in SI units, and of what dimension it is. Imports pint only, and that late."""
