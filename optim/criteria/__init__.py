"""What a design is judged by, with gradients."""
