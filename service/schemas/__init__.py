"""What the service takes and answers, as typed models."""
