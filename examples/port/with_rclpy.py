"""A node as it was written for rclpy: python examples/port/with_rclpy.py

with_protobuf.py is the same node with protobuf messages; compare them side by side. Both need message_filters of ROS.
"""

import math
from datetime import datetime, timedelta, timezone

import rclpy
import rclpy.executors
from geometry_msgs.msg import Vector3Stamped
from message_filters import ApproximateTimeSynchronizer, Subscriber
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
from sensor_msgs.msg import Imu, MagneticField
from std_msgs.msg import Header
from std_srvs.srv import SetBool


class Compass(Node):
    """Gives the direction of the magnetic field, once for each measurement of an IMU, while it is switched on."""

    def __init__(self) -> None:
        super().__init__("compass")
        self.is_on = False
        self.directions = self.create_publisher(Vector3Stamped, "direction", 10)
        self.create_service(SetBool, "switch", self.switch)
        sources = [Subscriber(self, Imu, "imu"), Subscriber(self, MagneticField, "field")]
        self.synchronizer = ApproximateTimeSynchronizer(sources, 10, 0.05)
        self.synchronizer.registerCallback(self.measure)

    def switch(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self.is_on = request.data
        response.success = True
        return response

    def measure(self, imu: Imu, field: MagneticField) -> None:
        if not self.is_on:
            return
        apart = Time.from_msg(field.header.stamp) - Time.from_msg(imu.header.stamp)
        direction = Vector3Stamped()
        direction.header.stamp = self.get_clock().now().to_msg()
        direction.vector = field.magnetic_field
        self.directions.publish(direction)

        stamp = imu.header.stamp
        measured = datetime.fromtimestamp(stamp.sec, timezone.utc) + timedelta(
            microseconds=stamp.nanosec // 1000
        )
        heading = math.degrees(math.atan2(field.magnetic_field.y, field.magnetic_field.x))
        self.get_logger().info(f"{measured}: {heading:.0f} degrees, {apart.nanoseconds} ns apart")


class Robot(Node):
    """Switches the compass on, and measures once."""

    def __init__(self) -> None:
        super().__init__("robot")
        self.client = self.create_client(SetBool, "switch")
        self.imu = self.create_publisher(Imu, "imu", 10)
        self.field = self.create_publisher(MagneticField, "field", 10)
        self.create_subscription(Vector3Stamped, "direction", self.receive, 10)
        self.received: list[Vector3Stamped] = []

    def measure(self) -> None:
        time = Time(seconds=1_767_268_800, nanoseconds=500_000_000)
        self.imu.publish(Imu(header=Header(stamp=time.to_msg(), frame_id="imu")))
        field = MagneticField()
        field.header.stamp = (time + Duration(nanoseconds=2_000_000)).to_msg()
        field.magnetic_field.x = field.magnetic_field.y = 25e-6
        self.field.publish(field)

    def receive(self, direction: Vector3Stamped) -> None:
        age = self.get_clock().now() - Time.from_msg(direction.header.stamp)
        assert age < Duration(seconds=60)
        self.received.append(direction)


def main() -> None:
    compass, robot = Compass(), Robot()
    executor = rclpy.executors.SingleThreadedExecutor()
    executor.add_node(compass)
    executor.add_node(robot)
    assert robot.client.wait_for_service(timeout_sec=10)
    executor.spin_until_future_complete(robot.client.call_async(SetBool.Request(data=True)), 10)
    while not all(each.get_subscription_count() for each in (robot.imu, robot.field, compass.directions)):
        executor.spin_once(timeout_sec=0.1)
    robot.measure()
    while not robot.received:
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    compass.destroy_node()
    robot.destroy_node()


if __name__ == "__main__":
    rclpy.init()
    try:
        main()
    finally:
        rclpy.try_shutdown()
