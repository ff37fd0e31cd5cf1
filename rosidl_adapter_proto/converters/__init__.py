"""Converter plugins, after those of rosbag2: what turns messages of one serialization format into those of another."""
