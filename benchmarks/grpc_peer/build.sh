#!/usr/bin/env bash
# Builds grpc_peer in the folder that is named, and a key with certificate beside it.
#   benchmarks/grpc_peer/build.sh DIR     needs libgrpc++-dev, protobuf-compiler-grpc, openssl
set -euo pipefail
here=$(dirname "$(realpath "${BASH_SOURCE[0]}")")
out=${1:?the folder to build in}
mkdir -p "$out"
protoc -I "$here" --cpp_out="$out" --grpc_out="$out" --plugin=protoc-gen-grpc="$(command -v grpc_cpp_plugin)" "$here/frames.proto"
read -ra flags <<< "$(pkg-config --cflags --libs grpc++ protobuf)"
g++ -std=c++17 -O2 -I "$out" "$here/grpc_peer.cpp" "$out"/frames.pb.cc "$out"/frames.grpc.pb.cc "${flags[@]}" -o "$out/grpc_peer"
openssl req -x509 -newkey rsa:2048 -nodes -days 30 -subj /CN=localhost -addext subjectAltName=DNS:localhost -keyout "$out/key.pem" -out "$out/cert.pem" \
  2> /dev/null
