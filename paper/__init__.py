"""What paper 2116 computed, computed again and compared."""
