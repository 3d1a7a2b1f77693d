#!/usr/bin/env bash
# An authority of your own and one certificate for all machines: make_certificates.sh FOLDER. Give the files to nobody else.
set -euo pipefail
umask 077; mkdir -p "$1"; cd "$1"
openssl req -x509 -newkey rsa:2048 -nodes -days 365 -subj "/CN=survey authority" -keyout ca.key -out ca.pem 2> /dev/null
openssl req -newkey rsa:2048 -nodes -subj "/CN=survey" -keyout key.pem -out request.pem 2> /dev/null
openssl x509 -req -days 365 -in request.pem -CA ca.pem -CAkey ca.key -CAcreateserial -out cert.pem 2> /dev/null
rm request.pem
