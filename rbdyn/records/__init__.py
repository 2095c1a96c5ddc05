"""What is written down: records as JSON and in words, and finished parts of a long command."""
