"""What learned policies are trained on."""
