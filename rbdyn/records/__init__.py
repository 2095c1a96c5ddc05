"""What is written down: records as JSON, finished parts of a long command, files that carry their digest, and
where caches lie."""
