"""What people look at: plots, films, a live page, reports."""
