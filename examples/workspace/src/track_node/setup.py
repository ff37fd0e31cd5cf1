from setuptools import setup

setup(
    name="track_node",
    version="1.0.0",
    packages=["track_node"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/track_node"]),
        ("share/track_node", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    entry_points={
        "console_scripts": [
            "talker = track_node.talker:main",
            "listener = track_node.listener:main",
        ]
    },
)
