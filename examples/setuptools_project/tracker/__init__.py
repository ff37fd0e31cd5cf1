"""Uses protobuf types that are made when this project is built."""

from rosidl_proto.track_msgs.msg import Track, TrackAdapter


def serialized_track(number: int) -> bytes:
    """Return a track as ROS sends it."""
    return TrackAdapter.to_cdr(Track(id=number, label="robot"))
