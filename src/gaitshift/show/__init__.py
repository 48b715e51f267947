"""Visualisation: plots, films, a live page, reports."""
