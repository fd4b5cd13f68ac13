# armid_ros in ROS 2 Jazzy: a workspace that is built, and a clone in which `make test` works.
#
#   docker build -t armid .
#   docker run --rm -it armid ros2 run armid_ros simulated_arm --ros-args -p robot:=humanoid_arm
#   docker run --rm -it -v "$PWD:/data" -w /data armid armid inspect run.mcap --robot my_arm.urdf
#   docker run --rm -it -w /home/armid/ws/src/armid_ros armid make test
FROM ros:jazzy-ros-base

SHELL ["/bin/bash", "-o", "pipefail", "-c"]

# What `make` needs beforehand: venv, the headers of Python, compilers. Versions are those of the
# distribution that the image has.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install -y --no-install-recommends \
        build-essential \
        cmake \
        git \
        python3-colcon-common-extensions \
        python3-dev \
        python3-venv \
        ros-jazzy-control-msgs \
    && rm -rf /var/lib/apt/lists/*

# Nothing here needs root, and files in mounted folders are to belong to a person: the first one of
# most computers. The image may have a user of that number.
ARG UID=1000
RUN if getent passwd "$UID"; then userdel --remove "$(getent passwd "$UID" | cut -d : -f 1)"; fi \
    && useradd --create-home --shell /bin/bash --uid "$UID" armid
USER $UID
WORKDIR /home/armid/ws

# Ubuntu's Python takes no packages from pip; an environment that sees those of ROS does.
ENV VIRTUAL_ENV=/home/armid/env
ENV PATH=$VIRTUAL_ENV/bin:$PATH
COPY --chown=armid requirements src/armid_ros/requirements
RUN python3 -m venv --system-site-packages "$VIRTUAL_ENV" \
    && pip install --no-cache-dir -r src/armid_ros/requirements/run.in

# As the README says: the message package inside the clone is made visible once.
COPY --chown=armid . src/armid_ros
RUN ln -s armid_ros/msg_schemas src/armid_msgs \
    && . /opt/ros/jazzy/setup.bash \
    && colcon build \
    && . install/setup.bash \
    && src/armid_ros/docker/check

# Every command finds ROS 2, the nodes and armid.
ENTRYPOINT ["/home/armid/ws/src/armid_ros/docker/enter.sh"]
CMD ["bash"]
