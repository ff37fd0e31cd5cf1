"""Bags: what ROS recorded, read, converted and written, with no ROS installed."""
