"""How good a method is: estimates against truth."""
