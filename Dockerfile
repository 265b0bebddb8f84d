# surgebreak on Debian 12, its kernels compiled:  docker build -t surgebreak .
#   docker run --rm -v "$PWD:/work" surgebreak run CASE          results beside the case, in /work
#   docker run --rm -it -v "$PWD:/work" --entrypoint bash surgebreak
FROM debian:bookworm-slim

# The packages first: they change less often than the program. Without their versions: Debian keeps only the newest
# version of each package of a release, so that a pinned one cannot be installed any more after its next correction.
# hadolint ignore=DL3008
RUN apt-get update -q \
    && DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends yade python3-venv git \
    && rm -rf /var/lib/apt/lists/*

WORKDIR /opt/surgebreak
COPY . .
ENV XDG_CACHE_HOME=/opt/cache PYTHONDONTWRITEBYTECODE=1 PIP_NO_CACHE_DIR=1
RUN ./surgebreak doctor \
    && .venv/bin/python -m coupler.commands.warm_up \
    && chmod -R a+rwX /opt/cache

WORKDIR /work
ENTRYPOINT ["/opt/surgebreak/.venv/bin/surgebreak"]
CMD ["--help"]
