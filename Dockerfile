# docker build -t planar_mapping . && docker run -v "$PWD:/data" planar_mapping run single_pcd.yaml -i cloud.pcd -o out
FROM debian:bookworm-slim AS build
COPY . /planar_mapping
RUN /planar_mapping/scripts/package.sh

FROM debian:bookworm-slim
RUN --mount=from=build,source=/planar_mapping/out/packages,target=/packages \
    apt-get update && apt-get install -y --no-install-recommends /packages/*.deb libgl1-mesa-dri && rm -rf /var/lib/apt/lists/*
WORKDIR /data
ENTRYPOINT ["planar_map"]
