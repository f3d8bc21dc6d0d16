"""Solution paths over load or friction: continuation and exact event tracking."""
