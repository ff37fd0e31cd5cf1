"""Serves std_srvs/srv/SetBool with protobuf messages, and calls it: python examples/ros_service.py"""

import rclpy
from rosidl_proto.std_srvs.srv import SetBool

from rosidl_adapter_proto.ros import Node


class Light(Node):
    def __init__(self) -> None:
        super().__init__("light")
        self.is_on = False
        self.create_service(SetBool, "switch", self.switch)

    def switch(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = self.is_on != request.data
        self.is_on = request.data
        response.message = f"The light is {'on' if self.is_on else 'off'}"
        return response


def main() -> None:
    light = Light()
    client = light.create_client(SetBool, "switch")
    if not client.wait_for_service(timeout_sec=10):
        raise SystemExit("There is no service")
    for is_on in (True, True, False):
        future = client.call_async(SetBool.Request(data=is_on))
        rclpy.spin_until_future_complete(light, future, timeout_sec=10)
        response = future.result()
        if response is None:
            raise SystemExit("There was no response")
        light.get_logger().info(f"{response.message}; changed: {response.success}")
    light.destroy_node()


if __name__ == "__main__":
    rclpy.init()
    try:
        main()
    finally:
        rclpy.try_shutdown()
