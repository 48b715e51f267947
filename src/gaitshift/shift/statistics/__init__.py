"""What shift conditions watch: one statistic a file."""
