"""Walking along a branch of periodic responses over one parameter."""
