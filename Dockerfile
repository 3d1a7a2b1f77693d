# docker build -t planar_mapping . && docker run -v "$PWD:/data" planar_mapping run single_pcd.yaml -i cloud.pcd -o out
FROM debian:bookworm-slim AS build
COPY . /planar_mapping
WORKDIR /planar_mapping
RUN scripts/install_dependencies.sh --build-only
RUN cmake --preset release -DPLANAR_MAPPING_BUILD_TESTS=OFF -DPLANAR_MAPPING_BUILD_BENCHMARKS=OFF && cmake --build --preset release
RUN scripts/package.sh build

FROM debian:bookworm-slim
RUN --mount=from=build,source=/planar_mapping/out/packages,target=/packages \
    apt-get update && apt-get install -y --no-install-recommends \
      /packages/libplanar-mapping0_*.deb /packages/planar-mapping-[tv]*.deb /packages/python3-*.deb libgl1-mesa-dri && \
    rm -rf /var/lib/apt/lists/*
WORKDIR /data
ENTRYPOINT ["planar_map"]
