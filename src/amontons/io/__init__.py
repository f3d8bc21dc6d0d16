"""Everything read and written."""
