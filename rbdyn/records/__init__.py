"""What is written down: records as JSON, and finished parts of a long command."""
