# stairmap in a slim container, as a user without rights:
#   docker build -t stairmap .
#   docker run --rm stairmap demo
#   docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/data" stairmap run my_recording
# Other extras of pyproject.toml: --build-arg EXTRAS=report,sim,clouds,cluster
FROM python:3.12-slim-bookworm AS build
# Debian keeps one version of the compiler in each release.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends g++ \
    && rm -rf /var/lib/apt/lists/*
ARG EXTRAS=report,sim,clouds
COPY . /source
RUN python -m venv /opt/stairmap \
    && /opt/stairmap/bin/pip install --no-cache-dir "/source[${EXTRAS}]" \
    && /opt/stairmap/bin/stairmap --version

FROM python:3.12-slim-bookworm
COPY --from=build /opt/stairmap /opt/stairmap
RUN useradd --create-home --uid 1000 stairmap \
    && install --directory --owner=stairmap /data
# Matplotlib keeps its cache of fonts where any --user may write.
ENV PATH=/opt/stairmap/bin:$PATH MPLCONFIGDIR=/tmp/matplotlib PYTHONUNBUFFERED=1
USER 1000:1000
WORKDIR /data
ENTRYPOINT ["stairmap"]
CMD ["--help"]
