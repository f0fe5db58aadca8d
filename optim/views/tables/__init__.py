"""What people read of designs and studies, from the JSON objects that programs read."""
