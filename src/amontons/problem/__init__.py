"""The discrete problem: data, laws, judge, status, solution."""
