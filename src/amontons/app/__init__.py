"""What a user types and holds in the hand."""
