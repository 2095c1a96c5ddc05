"""What is written down: records as JSON, finished parts of a long command, files that carry their digest, the source code on
which bits depend, and where caches lie; what runs still cost, predicted from those measured."""
