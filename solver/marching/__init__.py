"""Time marching: the referee, which shares nothing with the balance."""
