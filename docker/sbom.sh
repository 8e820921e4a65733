#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Writes what the package database says is installed as an SPDX 2.3 document (JSON) to standard output.
#   docker/sbom.sh NAME VERSION
# The document's date is SOURCE_DATE_EPOCH where that is set, as for every reproducible build.
set -eu
[ $# -eq 2 ] || { echo "usage: sbom.sh NAME VERSION" >&2; exit 2; }
created=$(date -u -d "@${SOURCE_DATE_EPOCH:-$(date +%s)}" +%Y-%m-%dT%H:%M:%SZ)
release=$(. /etc/os-release && echo "$VERSION_CODENAME")

# db:Status-Abbrev leaves out what was removed but not purged. A database that can't be read is no empty list.
packages=$(dpkg-query -W -f='${db:Status-Abbrev}\t${Package}\t${Version}\t${Architecture}\t${source:Package}\t${source:Version}\n')
printf '%s\n' "$packages" \
  | awk -F '\t' '$1 ~ /^ii/' | LC_ALL=C sort -t "$(printf '\t')" -k 2,2 -k 4,4 \
  | awk -F '\t' -v name="$1" -v version="$2" -v created="$created" -v release="$release" '
    function quoted(text) { gsub(/[\\"]/, "\\\\&", text); return "\"" text "\"" }
    # Of package URLs: what their grammar reserves, percent-encoded.
    function encoded(text) { gsub(/%/, "%25", text); gsub(/:/, "%3A", text); gsub(/\+/, "%2B", text); return text }
    BEGIN {
      print "{\n \"spdxVersion\": \"SPDX-2.3\",\n \"dataLicense\": \"CC0-1.0\",\n \"SPDXID\": \"SPDXRef-DOCUMENT\","
      print " \"name\": " quoted(name "-" version) ","
      print " \"documentNamespace\": " quoted("urn:spdx:" name ":" version ":" created) ","
      print " \"creationInfo\": {\"created\": " quoted(created) ", \"creators\": [" quoted("Tool: " name "-sbom.sh") "]},"
      print " \"documentDescribes\": [\"SPDXRef-Image\"],\n \"packages\": ["
      printf "  {\"SPDXID\": \"SPDXRef-Image\", \"name\": %s, \"versionInfo\": %s, \"downloadLocation\": \"NOASSERTION\", \"filesAnalyzed\": false, \"licenseConcluded\": \"Apache-2.0\", \"licenseDeclared\": \"Apache-2.0\", \"copyrightText\": \"NOASSERTION\", \"primaryPackagePurpose\": \"CONTAINER\"}", quoted(name), quoted(version)
    }
    {
      id = "SPDXRef-Package-" $2 "-" $4
      gsub(/[^A-Za-z0-9.-]/, "-", id)
      ids[++count] = id
      printf ",\n  {\"SPDXID\": %s, \"name\": %s, \"versionInfo\": %s, \"supplier\": \"Organization: Debian\", \"downloadLocation\": \"NOASSERTION\", \"filesAnalyzed\": false, \"sourceInfo\": %s, \"licenseConcluded\": \"NOASSERTION\", \"licenseDeclared\": \"NOASSERTION\", \"copyrightText\": \"NOASSERTION\", \"externalRefs\": [{\"referenceCategory\": \"PACKAGE-MANAGER\", \"referenceType\": \"purl\", \"referenceLocator\": %s}]}", \
        quoted(id), quoted($2), quoted($3), quoted("built from " $5 " " $6), quoted("pkg:deb/debian/" encoded($2) "@" encoded($3) "?arch=" $4 "&distro=" release)
    }
    END {
      print "\n ],\n \"relationships\": ["
      printf "  {\"spdxElementId\": \"SPDXRef-DOCUMENT\", \"relationshipType\": \"DESCRIBES\", \"relatedSpdxElement\": \"SPDXRef-Image\"}"
      for (i = 1; i <= count; ++i)
        printf ",\n  {\"spdxElementId\": \"SPDXRef-Image\", \"relationshipType\": \"CONTAINS\", \"relatedSpdxElement\": %s}", quoted(ids[i])
      print "\n ]\n}"
    }'
